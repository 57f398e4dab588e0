#include "server/security/access_control.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/testing/test_folder.h"

namespace polyest::internal {
namespace {

class AccessControlTest : public testing::Test {
 protected:
  void SetUp() override {
    tokens_ = folder_.Write("tokens", reader_.line + "\n" + admin_.line + "\n");
    auto access = AccessControl::Open({.token_file = tokens_});
    ASSERT_TRUE(access.ok()) << access.status();
    access_ = *std::move(access);
  }

  absl::StatusOr<Caller> Authorize(const std::string& authorization, Method method) const {
    return access_->Authorize(Identification{.authorization = authorization}, method);
  }

  const NewToken reader_ = *MakeTokenFor("anna:chassis:reader");
  const NewToken admin_ = *MakeTokenFor("bert:engines:admin");
  TestFolder folder_;
  std::string tokens_;
  std::unique_ptr<AccessControl> access_;
};

TEST_F(AccessControlTest, KnowsTheCallerByTheToken) {
  const auto caller = Authorize("Bearer " + admin_.secret, "DeleteSession");
  ASSERT_TRUE(caller.ok()) << caller.status();
  EXPECT_EQ(caller->name, "bert");
  EXPECT_EQ(caller->tenant, "engines");
  EXPECT_EQ(caller->role, Role::kAdmin);
  // The case of the scheme does not matter (RFC 7235).
  EXPECT_TRUE(Authorize("bearer " + reader_.secret, "ListModels").ok());
}

TEST_F(AccessControlTest, AsksForAToken) {
  for (const std::string& header :
       {std::string(), reader_.secret, "Basic " + reader_.secret, "Bearer" + reader_.secret}) {
    const auto caller = Authorize(header, "ListModels");
    EXPECT_EQ(caller.status().code(), absl::StatusCode::kUnauthenticated);
    EXPECT_EQ(caller.status().message(), "a token is needed");
  }
  EXPECT_EQ(access_->Authorize(Identification{}, "ListModels").status().code(),
            absl::StatusCode::kUnauthenticated);
  // A certificate does not replace a token.
  EXPECT_EQ(
      access_->Authorize(Identification{.certificate_name = "anna"}, "ListModels").status().code(),
      absl::StatusCode::kUnauthenticated);
}

TEST_F(AccessControlTest, RefusesATokenThatItDoesNotKnow) {
  for (const std::string& token : {MakeToken(), reader_.secret + " ", std::string()}) {
    const auto caller = Authorize("Bearer " + token, "ListModels");
    EXPECT_EQ(caller.status().code(), absl::StatusCode::kUnauthenticated);
    EXPECT_EQ(caller.status().message(), "the token is not known");
  }
}

TEST_F(AccessControlTest, NamesTheRoleNeededAndTheRoleHeld) {
  const auto caller = Authorize("Bearer " + reader_.secret, "AddMeasurements");
  EXPECT_EQ(caller.status().code(), absl::StatusCode::kPermissionDenied);
  EXPECT_EQ(caller.status().message(),
            "AddMeasurements needs the role writer, the token has reader");
}

TEST_F(AccessControlTest, ForgetsATokenThatIsTakenOut) {
  folder_.Write("tokens", admin_.line);
  EXPECT_TRUE(Authorize("Bearer " + reader_.secret, "ListModels").ok());
  ASSERT_TRUE(access_->Reload().ok());
  EXPECT_FALSE(Authorize("Bearer " + reader_.secret, "ListModels").ok());
  EXPECT_TRUE(Authorize("Bearer " + admin_.secret, "ListModels").ok());
}

TEST_F(AccessControlTest, KeepsTheOldTokensWhenTheNewOnesAreNoGood) {
  folder_.Write("tokens", "nonsense");
  EXPECT_EQ(access_->Reload().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_TRUE(Authorize("Bearer " + reader_.secret, "ListModels").ok());
}

TEST_F(AccessControlTest, RefusesToOpenWithoutItsFile) {
  EXPECT_EQ(AccessControl::Open({.token_file = tokens_ + "x"}).status().code(),
            absl::StatusCode::kNotFound);
}

TEST(AccessControl, TakesEverybodyForAnOperatorWithoutAuthentication) {
  const auto access = *AccessControl::Open({});
  const auto caller = access->Authorize(Identification{}, "DeleteSession");
  ASSERT_TRUE(caller.ok());
  EXPECT_EQ(caller->tenant, "default");
  EXPECT_EQ(caller->role, Role::kOperator);
  EXPECT_EQ(caller->name, "anonymous");
}

TEST(AccessControl, KnowsHoldersOfCertificatesByTheirNames) {
  const auto access = *AccessControl::Open({.client_certificates = true});
  const auto caller =
      access->Authorize(Identification{.certificate_name = "rig 1"}, "DeleteSession");
  ASSERT_TRUE(caller.ok());
  EXPECT_EQ(caller->tenant, "default");
  EXPECT_EQ(caller->role, Role::kOperator);
  EXPECT_EQ(caller->name, "rig 1");
}

}  // namespace
}  // namespace polyest::internal
