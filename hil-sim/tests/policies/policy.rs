//! Policies: what holds in every tick of either side, whatever happens.

mod drive;
mod events;
mod force;
mod lease;
mod line;
mod modules;

use crate::moment::Moment;

/// A statement about every tick. It says nothing of a tick that it is not about.
pub(crate) struct Policy {
    pub(crate) says: &'static str,
    pub(crate) holds: fn(&Moment<'_>) -> Option<bool>,
}

const fn policy(says: &'static str, holds: fn(&Moment<'_>) -> Option<bool>) -> Policy {
    Policy { says, holds }
}

/// Every policy.
pub(crate) const POLICIES: &[Policy] = &[
    policy("a force is a finite number in its range", force::in_range),
    policy("no force changes faster than its rate", force::within_rate),
    policy("what nothing cuts is what the scheme commands, bit for bit", force::as_commanded),
    policy("what is cut is the nearest to the command that range and rate allow", force::nearest),
    policy("a device that is held back goes to zero at its full rate", force::to_zero),
    policy("without the lease nothing moves", lease::moves_with_it_alone),
    policy("a lease that is held disarms nobody", lease::disarms_without_it_alone),
    policy("a fault ends the lease", lease::ends_by_a_fault),
    policy("a STOP ends the lease", lease::ends_by_a_stop),
    policy("who does not hold the lease changes nothing while another does", lease::keeps_strangers_out),
    policy("the drive goes along CiA 402's transitions", drive::transitions),
    policy("a fault stays until a reset, and stays the same", drive::latches),
    policy("behind a fault, motion takes a reset and then the lease", drive::enables),
    policy("a reset is refused on the way to the safe value", drive::refuses_reset),
    policy("a fault reaction lasts as long as a force does", drive::reacts_while_moving),
    policy("a device is held back for a reason only", drive::held_back_for_a_reason),
    policy("a scheme that does not run moves nothing", drive::stopped_is_still),
    policy("a link that is silent for 20 ticks takes the force away", line::silence_is_noticed),
    policy("a link is called lost after 20 silent ticks, not before", line::lost_is_silent),
    policy("the line gives out no more energy than it got", line::is_passive),
    policy("a frame that is none moves nothing, calls nothing and sends nothing", modules::bad_frame),
    policy("a module that writes what it must not is cut out in that tick", modules::bad_write),
    policy("a module that takes too long is cut out in that tick", modules::too_long),
    policy("what is cut out is not called again before it is let in", modules::stays_out),
    policy("what is cut out sends nothing", modules::sends_nothing),
    policy("no module is blamed that did nothing wrong", modules::blamed_rightly),
    policy("what the device depends on and is cut out holds it back", modules::fallen_driver),
    policy("a new reason is in the log with its tick and number", events::reason_is_logged),
    policy("nothing is in the log that did not happen", events::nothing_else_is_logged),
    policy("ticks, events and refused frames are counted, and never less", events::counters_rise),
    policy("each tick counts for its reason once", events::counted_once),
];
