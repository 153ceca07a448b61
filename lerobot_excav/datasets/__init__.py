"""Datasets of paired demonstrations, by what is done with them.

- `format`: what a frame holds, how pictures are stored, and reading a dataset back episode by episode.
- `pairs`: the paired-scene index; which episodes are chosen by it, and which are held out.
- `record`: recording with the scripted operator, in parallel and resumable.
- `complete`: adding to a recording of `lerobot-record` what only the simulation knows.
- `check`: the quality check.
"""
