"""What there is: objects, receiver, robot, and the space around them."""
