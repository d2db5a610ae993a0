#include "server/work/turn_order.h"

namespace tessera::server {
namespace {

/// By priority and by age: what one has while another one waits, too.
constexpr std::array kRankWeights{1.0, 8.0, 64.0};
constexpr std::array kAgeWeights{16.0, 8.0, 4.0, 2.0, 1.0};

double in_seconds(TurnOrder::Time time) { return std::chrono::duration<double>(time).count(); }

std::size_t age_after(TurnOrder::Time used) {
  std::size_t age = 0;
  for (TurnOrder::Time until = TurnOrder::kYouth; used >= until && age + 1 < TurnOrder::kAges; until *= 8) ++age;
  return age;
}

/// What a part will have had, for its weight, after one more turn.
template <typename Part>
double after_turn(const Part& part) {
  return part.had + in_seconds(TurnOrder::kTurn) / part.weight;
}

/// Whether `a` is next rather than `b`.
template <typename Part>
bool is_before(const Part& a, const Part& b) {
  return a.waiting > 0 && (b.waiting == 0 || after_turn(a) < after_turn(b));
}

}  // namespace

TurnOrder::TurnOrder() = default;
TurnOrder::~TurnOrder() = default;

TurnOrder::Account::Account(TurnOrder& order, const Claim& claim)
    : owner_(order.find_owner(claim)),
      rank_(owner_->ranks[static_cast<std::size_t>(claim.priority)]),
      age_(&rank_.ages.front()),
      apart_{this},
      place_(apart_.begin()),
      ticket_(++order.last_ticket_) {}

std::shared_ptr<TurnOrder::Owner> TurnOrder::find_owner(const Claim& claim) {
  // One without jobs is as good as new once others have had as much.
  std::erase_if(owners_, [&](const auto& entry) {
    const Owner& owner = *entry.second;
    return entry.second.use_count() == 1 && owner.had <= all_.clock - in_seconds(kHeadStart);
  });
  std::shared_ptr<Owner>& owner = owners_[claim.owner];
  if (!owner) {
    owner = std::make_shared<Owner>();
    for (std::size_t i = 0; i < owner->ranks.size(); ++i) {
      owner->ranks[i].weight = kRankWeights[i];
      for (std::size_t age = 0; age < kAges; ++age) owner->ranks[i].ages[age].weight = kAgeWeights[age];
    }
  }
  owner->weight = claim.weight;
  return owner;
}

void TurnOrder::join(Share& part, const Share& whole, Time head_start) {
  if (part.waiting++ == 0) part.had = std::max(part.had, whole.clock - in_seconds(head_start));
}

void TurnOrder::set_waiting(Account& account, bool waits) {
  if (waits == account.waits_) return;
  account.waits_ = waits;
  if (waits) {
    join(*account.age_, account.rank_);
    join(account.rank_, *account.owner_);
    join(*account.owner_, all_, kHeadStart);
    ++all_.waiting;
    queue(account);
  } else {
    for (Share* share : {static_cast<Share*>(account.age_), static_cast<Share*>(&account.rank_),
                         static_cast<Share*>(account.owner_.get()), &all_})
      --share->waiting;
    account.apart_.splice(account.apart_.begin(), account.age_->in_turn, account.place_);
  }
}

/// One that comes back before its round is over has its place again.
void TurnOrder::queue(Account& account) {
  std::list<Account*>& in_turn = account.age_->in_turn;
  auto place = in_turn.end();
  if (!in_turn.empty() && in_turn.back()->ticket_ > account.ticket_)
    place = std::ranges::find_if(in_turn, [&](const Account* other) { return other->ticket_ > account.ticket_; });
  in_turn.splice(place, account.apart_);
}

bool TurnOrder::is_empty() const { return all_.waiting == 0; }

TurnOrder::Account* TurnOrder::next() {
  if (is_empty()) return nullptr;
  const auto by_time = [](const auto& a, const auto& b) { return is_before(a, b); };
  Owner& owner = *std::ranges::min_element(owners_, [](const auto& a, const auto& b) {
                    return is_before(*a.second, *b.second);
                  })->second;
  Rank& rank = *std::ranges::min_element(owner.ranks, by_time);
  Age& age = *std::ranges::min_element(rank.ages, by_time);
  all_.clock = std::max(all_.clock, owner.had);
  owner.clock = std::max(owner.clock, rank.had);
  rank.clock = std::max(rank.clock, age.had);
  return age.in_turn.front();
}

void TurnOrder::charge(Account& account, Time time) {
  for (Share* share : {static_cast<Share*>(account.age_), static_cast<Share*>(&account.rank_),
                       static_cast<Share*>(account.owner_.get())})
    share->had += in_seconds(time) / share->weight;
  account.left_ -= time;
}

void TurnOrder::begin_turn(Account& account) {
  charge(account, kTurn);
  ++account.turns_;
}

void TurnOrder::end_turn(Account& account, Time spent) {
  charge(account, spent - kTurn);
  --account.turns_;
  account.used_ += spent;
  Age& age = account.rank_.ages[age_after(account.used_)];
  if (account.left_ > Time::zero() && account.age_ == &age) return;
  const bool waits = account.waits_;
  set_waiting(account, false);
  set_age(account, age);
  account.left_ = kRound;
  account.ticket_ = ++last_ticket_;
  set_waiting(account, waits);
}

void TurnOrder::set_age(Account& account, Age& age) {
  const double begun = account.turns_ * in_seconds(kTurn);  // Counted where it will be corrected.
  account.age_->had -= begun / account.age_->weight;
  account.age_ = &age;
  age.had += begun / age.weight;
}

bool TurnOrder::goes_before(const Account& waiting, const Account& at_work) const {
  if (waiting.owner_ != at_work.owner_) return after_turn(*waiting.owner_) < after_turn(*at_work.owner_);
  if (&waiting.rank_ != &at_work.rank_) return after_turn(waiting.rank_) < after_turn(at_work.rank_);
  return waiting.age_ != at_work.age_ && after_turn(*waiting.age_) < after_turn(*at_work.age_);
}

void TurnOrder::for_all_waiting(const std::function<void(Account&)>& use) {
  for (const auto& entry : owners_)
    for (Rank& rank : entry.second->ranks)
      for (Age& age : rank.ages)
        for (auto next = age.in_turn.begin(); next != age.in_turn.end();) use(**next++);
}

}  // namespace tessera::server
