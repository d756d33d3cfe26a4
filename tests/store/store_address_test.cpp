#include "torsio/store/store_address.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/error_message.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using testing::HasSubstr;

TEST(StoreAddress, IsAFileOrAUrl) {
  EXPECT_EQ(store_address("elbow.sqlite").kind, StoreAddress::Kind::sqlite);
  EXPECT_EQ(store_address("postgresql://a@b/c").kind, StoreAddress::Kind::postgresql);
  EXPECT_EQ(store_address("postgres://a@b/c").kind, StoreAddress::Kind::postgresql);
  EXPECT_EQ(StoreAddress{}.kind, StoreAddress::Kind::memory);
}

TEST(StoreAddress, RefusesOtherKinds) {
  EXPECT_THAT(test::error_message([] { (void)store_address("mysql://host/x"); }),
              HasSubstr("postgresql://"));
  EXPECT_THAT(test::error_message([] { (void)store_address(""); }), HasSubstr("SQLite"));
}

TEST(StoreAddress, ItsNameHasNoPassword) {
  EXPECT_EQ(store_address("postgresql://a:secret@b:5432/c").name(), "postgresql://a@b:5432/c");
  EXPECT_EQ(store_address("postgresql://a@b:5432/c").name(), "postgresql://a@b:5432/c");
  EXPECT_EQ(store_address("postgresql://b:5432/c").name(), "postgresql://b:5432/c");
  EXPECT_EQ(store_address("postgresql://b/c?user=a&password=secret&sslmode=require").name(),
            "postgresql://b/c?user=a&password=&sslmode=require");
  EXPECT_EQ(store_address("postgresql://b/c?password=secret").name(), "postgresql://b/c?password=");
}

}  // namespace
}  // namespace torsio
