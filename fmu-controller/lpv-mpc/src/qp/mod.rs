//! The quadratic programme of the controller.
