"""Readers and writers: files become a Recording or a TeamLog; results become JSON and come back."""

from steelyard.io.log_files import read_recording
from steelyard.io.pendant import read_pendant
from steelyard.io.result_files import read_result, result_dict, write_result
from steelyard.io.team_files import read_team
from steelyard.io.teams.team_writing import write_team

__all__ = ["read_pendant", "read_recording", "read_result", "read_team", "result_dict", "write_result", "write_team"]
