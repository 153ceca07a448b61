"""Speed of this machine, films, and checks of the simulation against itself; not part of the wheel."""
