from .case import OBJECTIVES, Case, ListedCase, listed_cases, load_case
from .optimum import MESHES, Optimum, optimise
from .profile import Profile, profile_of, write_profile

__all__ = [
    "MESHES",
    "OBJECTIVES",
    "Case",
    "ListedCase",
    "Optimum",
    "Profile",
    "listed_cases",
    "load_case",
    "optimise",
    "profile_of",
    "write_profile",
]
