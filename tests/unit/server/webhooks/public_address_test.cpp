#include "server/webhooks/public_address.h"

#include <gtest/gtest.h>

namespace tessera::server {
namespace {

TEST(PublicAddress, IsWhatAnybodyOnTheInternetMayHave) {
  for (const char* address : {"1.1.1.1",
                              "9.255.255.255",
                              "11.0.0.0",
                              "100.63.255.255",
                              "100.128.0.0",
                              "126.255.255.255",
                              "128.0.0.1",
                              "169.253.255.255",
                              "169.255.0.0",
                              "172.15.255.255",
                              "172.32.0.0",
                              "192.0.1.0",
                              "192.167.255.255",
                              "192.169.0.0",
                              "198.17.255.255",
                              "198.20.0.0",
                              "223.255.255.255",
                              "2001:200::1",
                              "2606:4700:4700::1111",
                              "2a00:1450::1",
                              "::ffff:1.1.1.1",
                              "64:ff9b::1.1.1.1",
                              "2001:db7:ffff::1",
                              "3ffe::1"})
    EXPECT_TRUE(is_public_address(address)) << address;
}

TEST(PublicAddress, IsNoneOfANetworksOwn) {
  for (const char* address :
       {// IPv4: this network, private, carriers', loopback, link-local, protocols, documents, benchmarks, multicast.
        "0.0.0.0", "0.255.255.255", "10.0.0.0", "10.255.255.255", "100.64.0.0", "100.127.255.255", "127.0.0.1",
        "127.255.255.255", "169.254.0.0", "169.254.169.254", "169.254.255.255", "172.16.0.0", "172.31.255.255",
        "192.0.0.1", "192.0.2.1", "192.88.99.1", "192.168.0.0", "192.168.255.255", "198.18.0.0", "198.19.255.255",
        "198.51.100.1", "203.0.113.255", "224.0.0.1", "239.255.255.255", "240.0.0.1", "255.255.255.255",
        // IPv6: none, loopback, link-local, a site's own, the same of old, multicast, documents, tunnels.
        "::", "::1", "fe80::1", "febf::1", "fc00::1", "fdff:ffff::1", "fec0::1", "ff02::1", "ff0e::1", "2001:db8::1",
        "2001::1", "2001:2::1", "2001:1ff:ffff::1", "2002:7f00:1::", "2002:0808:0808::1", "3fff::1", "3fff:fff::1",
        "100::1", "4000::1", "5f00::1",
        // IPv4 in IPv6.
        "::ffff:127.0.0.1", "::ffff:10.0.0.1", "::ffff:169.254.169.254", "::127.0.0.1", "::1.1.1.1",
        "64:ff9b::10.0.0.1", "64:ff9b::7f00:1", "64:ff9b:1::1.1.1.1"})
    EXPECT_FALSE(is_public_address(address)) << address;
}

TEST(PublicAddress, IsAnAddress) {
  for (const char* text :
       {"", "example.org", "1.1.1", "16843009", "0x1010101", "01.1.1.1.1", "fe80::1%eth0", "[::1]"}) {
    EXPECT_FALSE(is_address(text)) << text;
    EXPECT_FALSE(is_public_address(text)) << text;
  }
  EXPECT_TRUE(is_address("127.0.0.1") && is_address("::1"));
}

}  // namespace
}  // namespace tessera::server
