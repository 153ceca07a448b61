"""A local web page on which a person sees a machine, points and drives; knows no policy and no dataset."""
