"""Where bytes come from: files, captures, directories and standard input, as chunks for framing."""

from mavframecheck.sources.paths import STDIN, Inputs, Stdin, expand
from mavframecheck.sources.recording import Recording, open_recording
from mavframecheck.sources.sniff import MISSIONS, RECORDINGS, Kind, sniff
from mavframecheck.sources.stream import NoRecordingError, SourceError

__all__ = [
    "MISSIONS",
    "RECORDINGS",
    "STDIN",
    "Inputs",
    "Kind",
    "NoRecordingError",
    "Recording",
    "SourceError",
    "Stdin",
    "expand",
    "open_recording",
    "sniff",
]
