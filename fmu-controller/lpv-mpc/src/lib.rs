//! Under construction.
#![forbid(unsafe_code)]
#![allow(non_snake_case, reason = "matrices keep the paper's capitals")]

pub mod qp;
