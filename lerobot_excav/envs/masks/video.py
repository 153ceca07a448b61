"""Which videos keep a mask as it was."""

from typing import Any

LOSSLESS_CODEC = "h264"
"""Codec that is lossless at crf=0; at the same value HEVC is not (grey levels of noise off by up to 24)."""
LOSSLESS_PIX_FMTS = ("yuv444p", "gbrp")
"""Pixel formats that keep every pixel's colour; all others average colours over neighbouring pixels."""


def keeps_masks(codec: Any, crf: Any, pix_fmt: Any) -> bool:
    """Tell whether a video of these settings keeps black and white; colours may be rounded by 2 grey levels."""
    return codec == LOSSLESS_CODEC and crf == 0 and pix_fmt in LOSSLESS_PIX_FMTS
