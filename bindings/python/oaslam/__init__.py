"""Object-aided monocular visual SLAM."""
from ._oaslam import *
from ._oaslam import __version__
