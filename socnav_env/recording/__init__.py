"""Episodes on disk: recording, reading, bit-exact replay, measurement and drawing.

May import `env` and what that is built of.
"""

from socnav_env.recording.arrays import RecordingError
from socnav_env.recording.files import Recording, RecordTrajectory, read_recording, record_episode, write_recording

__all__ = ["RecordTrajectory", "Recording", "RecordingError", "read_recording", "record_episode", "write_recording"]
