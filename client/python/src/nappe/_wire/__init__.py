"""What comes over the wire, as values: the contract, its errors, frames, topologies, and arrays of them."""
