"""Clocks that do not agree: how late each is, what that does to poses, and clocks that do not even keep still."""
