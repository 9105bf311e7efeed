//! Tree files: what is written is read again, what is broken is refused by name, what is wrong is listed.

mod draft;
mod level_draft;
mod n_ary;

mod file_faults;
mod file_mutations;
mod level_faults;
mod levels;
mod orders;
mod oriented_files;
mod refusals;
mod round_trips;
mod tables;
