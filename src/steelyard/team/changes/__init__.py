"""What changes during a session: grasps that slip or yield, robots that let go or join, poses that touch a table."""
