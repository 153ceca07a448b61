"""Loose soil as discrete elements: parcels with friction and rolling resistance.

store        arrays of all parcels
contact      force law of one contact
pairs        which parcels may touch
plates       contact with the bucket and the walls of the target box
ground       contact with the height fields
dynamics     sub-steps
birth        soil that the bucket cuts becomes parcels
load         which parcels the bucket carries, their sleep
settling     which parcels have come to rest
population   all parcels of a soil
"""
