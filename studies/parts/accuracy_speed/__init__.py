"""What the accuracy_speed study is made of: its scenes, points, promises and figures."""
