"""The version of the excavator's simulation.

Recorded actions lead to the recorded states again in the version that made them only. It counts changes of soil,
machine, scenes or targets after which a replay deviates, or a scene's number means another scene. Speed, pictures and
policies are not part of it: a checkpoint runs in every version.
"""

SIMULATION_VERSION = 2
"""What this package simulates, written into every dataset, session log and metrics file."""

UNMARKED_VERSION = 1
"""What made files that name no version: it was not written then."""

CHANGES = {
    1: "soil in the bucket as one volume, ballistic parcels; dig regions hidden from the main view were possible",
    2: "soil in the bucket as parcels in contact, hence other loads, forces and flows; every scene redrawn, with dig "
    "regions in view",
}
"""What each version is, or changed."""
