"""Towards thousands of worlds on a GPU: kernels of the soil in NVIDIA Warp, for many worlds at once.

Nothing in the environments uses them yet; `docs/explanation/towards_a_gpu.md` says which part maps to what. They need
the extra `gpu`, and run on a CPU, too, where a test holds them to the kernels that the soil uses.
"""
