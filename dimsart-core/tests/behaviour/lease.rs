//! Lease: one client may move the device, no longer than until the lease expires.
#![expect(clippy::unwrap_used, reason = "in helpers of tests as in tests")]

use dimsart_link::protocol::{Lease, LeaseAction, LeaseStatus, NO_CLIENT, Refusal};
use proptest::prelude::*;

const LENGTH: u32 = 200;
const ACTIONS: [LeaseAction; 4] =
    [LeaseAction::Read, LeaseAction::Take, LeaseAction::Renew, LeaseAction::Release];

fn held() -> Lease {
    let mut lease = Lease::new(LENGTH);
    lease.handle(1, LeaseAction::Take).unwrap();
    lease
}

#[test]
fn it_ends_exactly_its_length_after_the_last_renewal() {
    for early in [0, 1, 100, LENGTH - 1] {
        let mut lease = held();
        assert!((0..early).all(|_| lease.tick()));
        let status = lease.handle(1, LeaseAction::Renew).unwrap();
        assert_eq!(status, LeaseStatus { holder: 1, ticks_left: LENGTH });
        assert!((0..LENGTH).all(|_| lease.tick()), "renewed after {early}");
        assert!(!lease.tick(), "renewed after {early}");
        assert_eq!(lease.status(), LeaseStatus::default());
    }
}

#[test]
fn another_client_is_refused_by_the_holder_s_name_and_nothing_of_it_prolongs_the_lease() {
    let mut lease = held();
    for left in (0..LENGTH).rev() {
        lease.tick();
        for action in [LeaseAction::Take, LeaseAction::Renew, LeaseAction::Release] {
            if left > 0 {
                assert_eq!(lease.handle(2, action), Err(Refusal::Lease { holder: 1 }));
            }
        }
        lease.handle(1, LeaseAction::Read).unwrap();
        assert_eq!(lease.status().ticks_left, left);
    }
    assert!(!lease.tick());
    assert_eq!(lease.handle(2, LeaseAction::Take).unwrap().holder, 2);
}

#[test]
fn who_was_too_late_to_renew_has_to_take_it_anew() {
    let mut lease = held();
    (0..=LENGTH).for_each(|_| _ = lease.tick());
    assert_eq!(lease.handle(1, LeaseAction::Renew), Err(Refusal::Lease { holder: NO_CLIENT }));
    assert!(!lease.tick());
    lease.handle(1, LeaseAction::Take).unwrap();
    assert!(lease.tick());
}

#[test]
fn given_back_it_ends_at_once() {
    let mut lease = held();
    for _ in 0..2 {
        assert_eq!(lease.handle(1, LeaseAction::Release), Ok(LeaseStatus::default()));
        assert!(!lease.is_armed());
    }
    assert!(!lease.tick());
}

#[test]
fn nobody_is_no_client_and_a_device_without_a_lease_moves_without_one() {
    for action in &ACTIONS[1..] {
        assert_eq!(Lease::new(LENGTH).handle(NO_CLIENT, *action), Err(Refusal::NotFound));
    }
    let mut free = Lease::new(0);
    assert!(free.is_armed() && free.tick() && free.check(9).is_ok());
    assert!(ACTIONS.iter().all(|action| free.handle(1, *action) == Err(Refusal::NotFound)));
}

/// A second model of a lease: last renewal by client and time.
#[derive(Default)]
struct Model {
    holder: Option<(u8, u32)>,
    tick: u32,
}

impl Model {
    fn holder(&self) -> Option<u8> {
        self.holder.filter(|(_, at)| self.tick - at <= LENGTH).map(|(holder, _)| holder)
    }
}

proptest! {
    #[test]
    fn never_two_holders_and_never_longer_than_it_was_renewed_for(
        steps in proptest::collection::vec((1u8..4, 0usize..4, 0u32..150), 1..300),
    ) {
        let (mut lease, mut model) = (Lease::new(LENGTH), Model::default());
        for (client, action, ticks) in steps {
            for _ in 0..ticks {
                let is_armed = lease.tick();
                model.tick += 1;
                prop_assert_eq!(is_armed, model.holder().is_some());
            }
            let holder = model.holder();
            let action = ACTIONS[action];
            let result = lease.handle(client, action);
            let is_mine = holder == Some(client);
            let expected = match action {
                LeaseAction::Read => true,
                LeaseAction::Renew => is_mine,
                _ => is_mine || holder.is_none(),
            };
            prop_assert_eq!(result.is_ok(), expected);
            if expected && matches!(action, LeaseAction::Take | LeaseAction::Renew) {
                model.holder = Some((client, model.tick));
            } else if expected && action == LeaseAction::Release {
                model.holder = None;
            }
            let other = client % 3 + 1;
            prop_assert_eq!(lease.check(other).is_ok(), model.holder().is_none_or(|it| it == other));
        }
    }
}
