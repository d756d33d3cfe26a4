#include "store/store_connection.hpp"

#include <algorithm>
#include <thread>
#include <utility>

#include "store/schema.hpp"

namespace torsio {

using Clock = StoreConnection::Clock;

StoreConnection::StoreConnection(const StoreAddress& address, StudyStore::OnWait on_wait,
                                 double patience_s)
    : address_(address), on_wait_(std::move(on_wait)) {
  try {
    database_ = open_database(address_);
  } catch (const ConnectionLost& lost) {
    wait_for_server(lost, patience_s);
  }
  run([&](Database& database) { prepare_schema(database, address_.name()); });
}

double StoreConnection::seconds_since_outage() const {
  if (!back_at_) return std::numeric_limits<double>::infinity();
  return std::chrono::duration<double>(Clock::now() - *back_at_).count();
}

void StoreConnection::wait_for_server(const ConnectionLost& lost, double patience_s) {
  constexpr auto kAsk = std::chrono::milliseconds(250);
  constexpr auto kLongest = std::chrono::milliseconds(10'000);
  const auto begin = Clock::now();
  ConnectionLost last = lost;
  for (auto pause = std::chrono::milliseconds(100);; pause = std::min(2 * pause, kLongest)) {
    const std::chrono::duration<double> waiting = Clock::now() - begin;
    if (!last.is_temporary() && waiting.count() >= patience_s) throw ConnectionLost(last);
    for (auto waited = std::chrono::milliseconds(0); waited < pause; waited += kAsk) {
      if (on_wait_ && !on_wait_(last.what())) throw Cancelled();
      std::this_thread::sleep_for(std::min(kAsk, pause));
    }
    try {
      if (database_)
        database_->reconnect();
      else
        database_ = open_database(address_);
      break;
    } catch (const ConnectionLost& again) {
      last = again;
    }
  }
  back_at_ = Clock::now();
  if (on_wait_) on_wait_({});
}

std::unique_ptr<Database> open_database(const StoreAddress& address) {
  return address.kind == StoreAddress::Kind::postgresql ? open_postgresql(address)
                                                        : open_sqlite(address);
}

}  // namespace torsio
