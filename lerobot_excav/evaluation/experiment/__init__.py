"""Experiments of several stages: `experiment` reads them from a file, `runner` runs what is not finished.

A stage is one command that makes one folder; `words` puts the settings into it. `stage` knows its files, `stage_run`
runs it once, `stage_record` tells afterwards what was run, and for how long, `stage_state` whether that is what the
file would make now.
"""
