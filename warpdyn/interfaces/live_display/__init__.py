"""A local web page that shows a live ensemble while its motion arrives."""
