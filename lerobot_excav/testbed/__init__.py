"""A machine behind a wire: datagrams, safety, pictures over the network, and an emulator that stands in for it."""
