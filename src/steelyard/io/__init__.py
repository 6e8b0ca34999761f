"""Readers and writers: files become a Recording; results become JSON and come back."""

from steelyard.io.log_files import read_recording
from steelyard.io.pendant import read_pendant
from steelyard.io.result_files import result_dict, write_result
from steelyard.io.result_reading import read_result

__all__ = ["read_pendant", "read_recording", "read_result", "result_dict", "write_result"]
