"""What a fit of the whole log, aligned and with its noise, gives away of the sensor, the arm and the load.

What is told at a glance in `readings`, where it decides how numbers are read, is measured here.
"""
