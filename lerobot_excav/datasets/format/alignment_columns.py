"""Columns of a recording of a real machine: how old what was seen was when its action was sent."""

IMAGE_AGE_KEY, STATE_AGE_KEY = "excav.image_age_ms", "excav.state_age_ms"
IS_CAUSAL_KEY = "excav.is_causal"
"""Whether pictures and state were within their limits."""
IS_AS_TOLD_KEY = "excav.is_as_told"
"""Whether the machine did what the action says."""

ALIGNMENT_COLUMNS = {
    IMAGE_AGE_KEY: "float32",
    STATE_AGE_KEY: "float32",
    IS_CAUSAL_KEY: "bool",
    IS_AS_TOLD_KEY: "bool",
}
"""All of them with their types, in the order of `NotedFrame`."""
