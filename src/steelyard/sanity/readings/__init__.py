"""The log as given beside the ways in which it is commonly misread; each is put right where there is no doubt.

All is told at a glance (`glance`), before clocks are aligned and noise is known, by fits of force and torque apart that
are cheap enough to be made for every reading. They tell conventions apart. Two masses, a tilt and a turn of the sensor
are asked for again in `fitted`, of the aligned log, by one weighted fit of all wrenches: there they are measured.
"""
