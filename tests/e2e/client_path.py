"""Who imports this can import the Python client, oaslam_client."""
import os
import sys

FOLDER = os.path.join(os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__)))), "server", "clients", "python")
sys.path.insert(0, FOLDER)
