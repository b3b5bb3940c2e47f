"""What is printed and shown to a camera: begin with `target`."""
