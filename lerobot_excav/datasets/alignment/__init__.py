"""How old what was seen was when an action was chosen: columns of recordings of a real machine."""
