"""Runs that are divided into regions, each drawn, integrated and written by itself: on a cluster's workers or here."""
