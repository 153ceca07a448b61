"""The causal audit of a policy: states are repeated bit by bit, only the mask differs, and what follows is compared."""
