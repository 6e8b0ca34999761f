"""What result files hold beside the ten numbers."""
