#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <string>

#include "proto/wire/priority.h"

namespace tessera::server {

/// For whom work is done.
struct Claim {
  std::string owner = {};
  proto::Priority priority = proto::Priority::normal;
  double weight = 1;  ///< The owner's, beside other owners.
};

/// Who of those that wait has the next turn. The time of threads is shared by weights in steps, each of which knows
/// nothing of those below it: among owners; among the priorities of an owner's jobs; among the ages of those, an age
/// being how much time a job has had so far; and among the jobs of an age in turn. So an owner of many jobs has no more
/// than one of few, no priority and no age waits until another one has nothing left, and a job ends soon that takes
/// little, whatever else there is, without anybody having to say how much it will take.
///
/// At each step the one is next that will have had least for its weight after one more turn (Demers, Keshav & Shenker
/// 1989), and who comes anew begins with what the one has had that was served last (Goyal, Vin & Cheng 1996). That is
/// deficit round-robin where a newcomer needn't wait for a round to end. It counts time, not samples: time is
/// what there is to be shared, samples of one job may cost a thousand times as much as those of another, and plans and
/// structures have none.
///
/// Knows no threads and no clock. Not safe to be called by several threads at once.
class TurnOrder {
 public:
  using Time = std::chrono::steady_clock::duration;

  /// A turn is meant to take so long. It is counted when it begins, and corrected when it ends.
  static constexpr Time kTurn = std::chrono::milliseconds(30);
  /// What jobs of the same age have before the next one is in turn: a small job is done by then, so that of many small
  /// ones few are begun at a time.
  static constexpr Time kRound = std::chrono::milliseconds(100);
  /// A job is older when it has had so much, and again each time that it has had eight times as much.
  static constexpr Time kYouth = std::chrono::milliseconds(100);
  static constexpr std::size_t kAges = 5;
  /// An owner who had nothing to be done for a while may be ahead of others by so much for its weight, and no more.
  static constexpr Time kHeadStart = std::chrono::milliseconds(500);

 private:
  struct Share;
  struct Age;
  struct Rank;
  struct Owner;

 public:
  /// A job: waits for turns, or doesn't.
  class Account {
   public:
    virtual ~Account() = default;
    Account(const Account&) = delete;

    /// What its turns have taken that have ended.
    Time used() const { return used_; }

   protected:
    Account(TurnOrder& order, const Claim& claim);

   private:
    friend TurnOrder;

    const std::shared_ptr<Owner> owner_;
    Rank& rank_;
    Age* age_;
    std::list<Account*> apart_;  ///< Itself, as long as it isn't among those who wait.
    const std::list<Account*>::iterator place_;
    bool waits_ = false;
    int turns_ = 0;         ///< That it is having.
    std::uint64_t ticket_;  ///< Its place among those of its age.
    Time left_ = kRound;    ///< Until others of its age are in turn.
    Time used_{};
  };

  TurnOrder();
  ~TurnOrder();

  /// Whether an account waits for turns. Takes no memory.
  void set_waiting(Account& account, bool waits);
  /// The one that is next; null when none waits.
  Account* next();
  bool is_empty() const;
  /// A turn of an account, which may have several at once.
  void begin_turn(Account& account);
  void end_turn(Account& account, Time spent);
  /// Whether one that waits is to go on rather than the other, which is having its turn.
  bool goes_before(const Account& waiting, const Account& at_work) const;
  /// Calls `use` with each account that waits; it may have that one not wait any more.
  void for_all_waiting(const std::function<void(Account&)>& use);

 private:
  /// A part of the whole, or of another part.
  struct Share {
    double weight = 1;
    double had = 0;           ///< In seconds, for each of its weight.
    double clock = 0;         ///< Among its own parts: what the one had had that was served last.
    std::size_t waiting = 0;  ///< Accounts.
  };
  struct Age : Share {
    std::list<Account*> in_turn;
  };
  /// A priority.
  struct Rank : Share {
    std::array<Age, kAges> ages;
  };
  struct Owner : Share {
    std::array<Rank, 3> ranks;
  };

  std::shared_ptr<Owner> find_owner(const Claim& claim);
  void join(Share& part, const Share& whole, Time head_start = {});
  void queue(Account& account);
  void charge(Account& account, Time time);
  void set_age(Account& account, Age& age);

  Share all_;
  std::map<std::string, std::shared_ptr<Owner>> owners_;  ///< That have accounts, or have had more than others.
  std::uint64_t last_ticket_ = 0;
};

}  // namespace tessera::server
