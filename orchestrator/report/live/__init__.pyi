from .making import Live, check_live, make_live
from .tracks import Track, tracks_of

__all__ = ["Live", "Track", "check_live", "make_live", "tracks_of"]
