"""dmoc beside ASSET and CasADi by hand: the same problems, each tool in a process of its own."""
