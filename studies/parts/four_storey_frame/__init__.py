"""Parts of the study studies/four_storey_frame.py."""
