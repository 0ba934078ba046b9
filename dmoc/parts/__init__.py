"""The parts that a problem is made of: actuators, objectives and constraints."""
