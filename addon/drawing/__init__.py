"""What is drawn over the scene, by the graphics card."""
