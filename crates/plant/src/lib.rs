//! The simulated robot: multibody, servo, sensors, soft soles and stabiliser.
