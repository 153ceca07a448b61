"""The excavator's policy on the emulated test bed, behind wires that are late or lose datagrams."""
