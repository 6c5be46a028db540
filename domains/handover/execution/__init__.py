"""Execution: perceive, infer, plan, grasp, approach, hold, release; with a safety distance checked at every step."""
