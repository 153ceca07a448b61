"""Slow, obvious versions of the compiled kernels, written from their definitions.

Tests hold each kernel against its twin here; nothing else uses this package.

avalanche    relaxation: one sweep
bucket       cutting: what is inside, and how it got there
worlds       small worlds, in which tests let kernels and twins meet
wedge        wedge: the soil above a failure plane
contact      parcels.contact: force law of one contact
pairs        parcels.pairs and the pair forces of parcels.dynamics: every parcel against every other
plates       parcels.plates: a sphere against polygons
ground       parcels.ground: the bilinear surface as a sum over its corners
motion       parcels.dynamics: one whole sub-step
load         parcels.load: which parcels a bucket carries
"""
