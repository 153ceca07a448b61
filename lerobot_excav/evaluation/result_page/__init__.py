"""The result page of an experiment: `contents` says what is on it, `page` computes it, `page_text` writes it.

`curves` are success against training, `plots` draw them, `video_grid` shows rollouts side by side, and
`kept_grid` remembers which.
"""
