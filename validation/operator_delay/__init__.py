"""How the frame rate and a delay of the commands change what an operator achieves."""
