"""When the robot held one body alone: contact, a change of load, a slip."""
