"""Where and how to hand over: costs, what solvers can tell, and the proven best of all places and grasps."""
