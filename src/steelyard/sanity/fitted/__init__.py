"""What a fit of the whole log gives away of the sensor, the arm and the load."""
