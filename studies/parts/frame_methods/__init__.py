"""Parts of the study studies/frame_methods.py."""
