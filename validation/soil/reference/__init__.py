"""Slow, obvious versions of the compiled kernels, written from their definitions.

Tests hold each kernel against its twin here, which names it in its first line, in the small worlds of `worlds`; nothing
else uses this package.
"""
