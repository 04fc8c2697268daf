"""A planned gait played back in MuJoCo, a physics engine that shares no formula with the model (extra ``sim``)."""
