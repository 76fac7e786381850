//! Plays the robot: HRP-4 on soft soles.
