"""Rigid poses, serial arms, inverse kinematics, joint paths."""
