"""Random actions in search of states that must not be: lost mass, numbers that are none, soil below its floor.

actions   styles of random actions
case      one numbered case: what it is made of, and how it is played
soundness what has to hold after every step
run       many cases in several processes, and the files of those that failed
"""
