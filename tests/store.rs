//! The store as its users see it: what was sent is there, once, whatever happened in between.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "helpers of tests are tests too")]

#[path = "store/birth.rs"]
mod birth;
#[path = "store/check.rs"]
mod check;
#[path = "store/clients.rs"]
mod clients;
#[path = "store/columns.rs"]
mod columns;
#[path = "store/compact.rs"]
mod compact;
#[path = "store/crash.rs"]
mod crash;
#[path = "store/export.rs"]
mod export;
#[path = "store/forget.rs"]
mod forget;
#[path = "store/make.rs"]
mod make;
#[path = "store/query.rs"]
mod query;
#[path = "store/scale.rs"]
mod scale;
#[path = "store/time_left.rs"]
mod time_left;
#[path = "store/upgrade.rs"]
mod upgrade;
#[path = "store/write.rs"]
mod write;
